"""YAML text to a scenario.

document          text -> plain data that remembers its lines
renamed_keys      earlier names of keys -> names of today
set_ups           overrides that go by one name
overrides         `path.to.key=value` applied to the data
validation        data -> scenario, or the one line that says what is wrong
"""
