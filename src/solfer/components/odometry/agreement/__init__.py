"""What most wheels tell, where some slide."""
