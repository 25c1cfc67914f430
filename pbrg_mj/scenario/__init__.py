"""The scenario room: YAML to frozen, validated data."""
