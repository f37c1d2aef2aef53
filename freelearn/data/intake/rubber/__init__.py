"""Raw files of tests of rubber alone, as tables of specimen tests."""
