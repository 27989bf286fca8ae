"""Contracts of the plug-in points: what a plug-in must do beside having the right methods."""
