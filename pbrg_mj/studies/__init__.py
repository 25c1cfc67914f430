"""Many runs of one question, written on the API: sweeps, and what is built on them.

task          one run: scenario, settings, seed
worker        a process that makes runs for another one
run_task      a task -> its record
backends      processes of this machine, or workers of Dask
journal       finished runs on disk
runner        the runs of a study in a folder, none made twice
document      a study's YAML file
records       records as Parquet
sweep_plan    SWEEP.yaml -> tasks
sweep         `pbrg sweep`
optimizer     points to try, by the values of earlier ones
tune          `pbrg tune`
failures      how near a run came to a failure
shrink        a scenario made smaller that shows it
falsify       `pbrg falsify`
bench         `pbrg bench`: suites as one table, and that table verified
"""
