"""Build of the page's script: `python -m anim.show.page.build`."""
