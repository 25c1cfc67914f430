"""The benchmark: suites of worlds, governors, networks and seeds as one table.

suite         SUITE.yaml -> tasks
statistics    quartiles, shifted geometric means, intervals of paired differences
table         records -> rows of the table
columns       what the columns of the tables hold, in words
text          the table for a terminal
markdown      the table and its runs in Markdown
pictures      a run as a drawing
page          the table, pictures, logs and commands as one page
bench         `pbrg bench`
release       `pbrg bench --release`: SHA-256 of every file, checked before a folder is verified
verify        `pbrg bench --verify`
"""
