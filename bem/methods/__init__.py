"""The methods that answer a scene, one folder each."""
