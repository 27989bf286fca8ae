"""What is taken where nothing else is asked for, as `identify` has it; apart, since the command line's help loads no more."""

CHAIN, ESTIMATOR = "idbench", "GLS"
