"""Estimators of motion and parameters together."""
