"""What noise of a log does to its rows: levels, covariance, whitening, and what it adds to W."""
