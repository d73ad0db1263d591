"""The command `gltf-anim`: private, not an API. Scripts import `anim`."""
