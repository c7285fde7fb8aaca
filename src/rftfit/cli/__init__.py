"""The ``rftfit`` command: one small module per command, messages that a user can act on."""
