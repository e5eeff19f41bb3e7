"""Soft viscoelastic contacts, whose edge is a crack with a process zone much smaller than the contact."""
