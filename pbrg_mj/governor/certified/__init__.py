"""Governors that apply only what a certificate of the whole team has verified."""
