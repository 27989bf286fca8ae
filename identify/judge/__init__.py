"""How good an estimate is: validation, delay, noise, excitation."""
