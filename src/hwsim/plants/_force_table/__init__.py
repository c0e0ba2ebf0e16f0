"""`ForceTableStand`: a bead under the disk, sample by sample, under force control."""
