"""The numbers of a run, from the log's arrays and the scenario's true obstacles.

obstacles         walls and boxes as rectangles with faces
nearest_point     the nearest point to another one behind lines
reachable_places  where robots that go beside obstacles can bring their formation
best_formation    the point where the team should come to rest
contacts          which contacts there were, and which of them violate the run
margins           distances to true and sensed lines, the ball's radius
reachable         what a robot could have reached while a box came at it
avoidance         contacts with moving boxes, and which of them were avoidable
multiplier_rows   which half-space each multiplier belongs to, and where half-spaces held robots
area_of_interest  what a picture of a run shows of the plane
trend             where a team is going, by its distance over the last seconds
outcome           how the run ended, in one word
binding           what binds at the end, in words
sensing_gap       what sensing costs: the optimum on sensed against true half-spaces
samples           means and exact percentiles of numbers that are not held
index_join        ticks and optima brought together while both are read
settling          since when the team has been there
logged_motion     the robots' own motion behind motors, from a log's commands
per_tick          what metrics take from large columns, a number per tick
safety_totals, certificate_totals, optimum_totals    sums over a run, a block of its log at a time
run_metrics       all metrics of a run
log_metrics       the same of a log that is not held
record_metrics    the same of a run without a log
table             metrics of several runs as text
paper_table       the paper's four runs as Markdown and JSON
rates             how often something happened, with confidence intervals
world_metrics     metrics of each of many worlds, and of all together
batch_metrics     metrics and arrays of many worlds run in a batch
"""
