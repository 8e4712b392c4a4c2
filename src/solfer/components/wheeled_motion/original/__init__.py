"""What the original program does as `law: original` has it: its steering, and wheels that turn back."""
