"""The re-enacted lab: logs as the real lab would have recorded them, computed from published results.

The lab shares no force code with the analysis. `enact.prepare` plans a campaign and `Reenactment.write` writes it,
`rig.FAULTS` lists faults that can be put into it on purpose; other labs derive from `rig.Lab`.
"""
