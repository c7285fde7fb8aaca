"""Figures, workbooks and quality sheets made from the tables of the measurement chain.

Every ``draw_*`` function is pure: pandas frames in, a matplotlib ``Figure`` out, made without
pyplot. `rftfit.report.saving.save` writes a figure; `rftfit.report.workbooks` writes workbooks.
"""
