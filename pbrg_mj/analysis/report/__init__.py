"""One self-contained page about one or several runs: figures, a film seen from above, numbers, the scenario."""
