"""The Python API: what `import pbrg_mj` offers, and what the command line is written on.

scenario      a file, a bundled name or data -> Scenario
seeds         `1-8,20`
files         names of files, checked before anything slow
simulate      Scenario, governor -> Run, tick by tick or to the end; live server
batch         many seeds side by side
log_reading   a log read as a whole, or a warning of its damage
run           Run: arrays, numbers, figures, page, export
logs          a log -> Run, or its numbers, figures, page, export at once
arrays        arrays by name
compare       runs -> one table
video         Run -> video or still
replay        a log simulated again and compared; a damaged log repaired
reproduce     the paper's four runs
datagrams     the .proto text of what robots' processes send
checking      whether a governor of one's own keeps the protocol
plug_in_metrics   metrics of one's own
doctor        what works on this machine
interrupt, garbage_collection, profile    Ctrl-C, Python's garbage and the clock during a run
"""
