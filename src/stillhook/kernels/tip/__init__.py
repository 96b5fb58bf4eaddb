"""Motion of the crane tip inside a kernel: sampled, or from the motion of the vessel."""
