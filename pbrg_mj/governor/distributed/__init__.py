"""The paper's algorithm: rounds of messages between neighbours."""
