"""`python -m anim`: the command `gltf-anim`."""

from cli.entry_point import main

if __name__ == "__main__":
    main()
