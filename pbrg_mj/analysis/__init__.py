"""From logs to numbers, figures and pages; reads logs, never live objects.

series            the log's arrays under their public names
export            the arrays as .npz, .mat and .csv
dataset           the arrays as an `xarray.Dataset`
reduced_run       a log read for events, pictures and pages, without its largest columns
metrics           outcome, margins, gaps to the optimum, tables
figures           the figures of a paper
report            one self-contained page about one or several runs
events            what happened when
replay_summary    a run in a few lines
output_file       files that are whole or not there
"""
