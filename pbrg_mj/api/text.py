"""Text from logs and scenarios, made safe to show."""

from pbrg_mj.analysis.text import plain

__all__ = ["plain"]
