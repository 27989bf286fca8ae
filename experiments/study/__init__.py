"""Studies: a scenario over a grid of settings and independent seeds, identified by every model, chain and estimator."""
