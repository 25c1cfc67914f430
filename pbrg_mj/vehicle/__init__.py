"""The vehicle package: hand point and wheels."""
