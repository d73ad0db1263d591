"""Cloth: meshes of points that keep their distances, by extended position-based dynamics or as masses and springs."""
