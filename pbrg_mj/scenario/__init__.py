"""From YAML to a frozen, validated `Scenario`.

load              a file or bundled name, with overrides -> Scenario
find              a file or bundled name -> the file
bundled           where the bundled scenarios and models are
parse             YAML text -> data with line numbers -> overrides -> Scenario
polygons          simple polygons in convex parts
robots            the bundled robots and their sizes
schema            what a scenario may say, a module per section
families          scenarios that draw a world for each seed
checks            what must hold between the keys
diagnostics       what is wrong, where, in one line
random_streams    random numbers fixed by the scenario's seed
"""
