"""The command line, written on the Python API (`pbrg_mj`, `pbrg_mj.api`) and nothing else.

main          the commands and their exit codes
scenarios     list, show, new, schema, validate
run, batch, reproduce    simulate
robot         a robot of a run on another machine
sweep, tune    many runs as one table, or to find the best values
falsify       a search for a failure
bench         a suite of worlds and governors as one table
compare, export, plot, render, report    read logs
replay, repair    a log again, or what is whole in it
doctor        this machine
arguments, study    what several commands take
failures      how a command that fails ends
stdout        standard output for results alone
console, progress, real_time    the terminal, and the clock of those who look on
"""
