"""What the command line and `import brakecli` share: inputs, measured signals, thresholds and progress."""
