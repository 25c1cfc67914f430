"""The vehicle room: hand point and wheels."""
