"""Which effects a scene has, and which of them it calls for."""
