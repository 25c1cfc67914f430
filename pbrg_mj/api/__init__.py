"""The Python API: what `import pbrg_mj` offers, and what the command line is written on.

scenarios     a file, a bundled name or data -> Scenario
simulating    Scenario, governor -> Run, tick by tick or to the end; live server
runs          a log -> Run: arrays, numbers, figures, page, export
arrays        arrays by name
comparing     runs -> one table
films         Run -> film or still
replaying     a log simulated again and compared; a damaged log repaired
batches       many seeds side by side
paper         the paper's four runs
checking      whether a governor of one's own keeps the protocol
own_metrics   metrics of one's own
checkup       what works on this machine
interrupt, garbage, profile    Ctrl-C, Python's garbage and the clock during a run
text          text from logs made safe to show
"""
