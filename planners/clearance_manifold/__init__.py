"""Clearance-manifold navigation (Cui, Deng, Wang)."""
