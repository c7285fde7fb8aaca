"""The report page: one self-contained html file with live parts."""
