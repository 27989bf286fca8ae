"""What can be asked for: one frozen dataclass a job, filled by Python, the command line, or a TOML file."""
