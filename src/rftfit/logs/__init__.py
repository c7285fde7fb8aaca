"""Transducer and motion logs: one small reader per file dialect, behind one registry."""
