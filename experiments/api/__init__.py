"""What a researcher types: `import idbench`, a robot, a log, a fit."""
