"""Particles: emitted from nodes or surfaces, moved by forces, bounced by obstacles, written as animated nodes."""
