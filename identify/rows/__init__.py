"""Rows Y = W X + rho: operators, chains, triangular factors, and how noise reaches them."""
