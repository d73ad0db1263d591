"""Engine Rapier: other packages import its interface `world` alone, and `package` alone imports rapier3d."""
