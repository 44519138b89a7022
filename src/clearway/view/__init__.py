"""The viewer: agents watched and driven in the browser. The page's own files are in `page`."""
