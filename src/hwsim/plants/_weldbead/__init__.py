"""`WeldBeadStand`: a bead ground pass by pass."""
