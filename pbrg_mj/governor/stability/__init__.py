"""How long a round and how late a message may be, foreseen from the scenario alone."""
