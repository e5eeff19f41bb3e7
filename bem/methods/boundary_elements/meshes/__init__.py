"""Nodes that follow the contact edge."""
