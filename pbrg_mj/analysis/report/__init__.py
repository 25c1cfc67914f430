"""One self-contained page about one or several runs: figures, an animation seen from above, numbers, the scenario.

report_run            what the page keeps of one run
frames                which ticks the page shows
half_space_changes    the half-spaces, from frame to frame
scene                 obstacles and working areas under the animation
encode                numbers and text packed into the page
tables                cards and tables as HTML
page                  the page
"""
