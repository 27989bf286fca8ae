"""A MuJoCo testbench for the dynamic identification of robots."""
