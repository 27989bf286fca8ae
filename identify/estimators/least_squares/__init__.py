"""Estimators that solve the rows Y = W X + rho."""
