"""Sets of logs of real robots, identified and judged on logs that no fit has seen: one protocol for all."""
