"""The report page: one self-contained html file with live parts, made from the run's tables.

`rftfit.report.page.inputs` reads what it shows, `rftfit.report.page.page` writes it. The template,
the style sheet and the scripts lie beside this file.
"""
