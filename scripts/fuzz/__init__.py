"""Attacks on the command line, each reproduced by its seed: what a hostile file or a kill can do.

    sandbox     a command in a process of its own, with limits: how it ended
    verdict     whether a command may end so
    values      numbers, texts and lists that nobody expects
    damage      accidents of bytes and of texts
    mutants     bundled scenarios with accidents, by seed
    scenarios   every mutant is validated and run
    studies     families of worlds, sweeps, tunings, searches and suites likewise
    mcap        an MCAP file taken apart, and put together again with the right checksums
    forgeries   damaged and forged logs, by seed
    logs        every forgery is read by the commands that read logs
    kills       a run is killed at a random moment and its log read
    orphans     a study's process is killed alone, and those that make its runs must end

docs/reliability.md says what came of it.
"""
