"""What was measured: configuration and run sheet, validated, every problem at once."""
