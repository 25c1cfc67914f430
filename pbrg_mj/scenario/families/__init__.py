"""Families of worlds: scenarios with a section `draw`, of which every seed makes a concrete scenario.

schema            what `draw` may say
checks            what must hold between its keys
distributions     numbers from their distributions
team              starts and formations: points in a disc that keep apart
frame             along and across the team's way to its reference
shapes            walls, rooms, boxes in the words of `world`
placement         obstacles drawn again until start and formation are free of them
buildings         a place on the way through a building, with the walls about it
json_schema       the schema for editors
draw              a family and a seed -> a concrete document
"""
