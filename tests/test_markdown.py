from clearway.markdown import table_lines


def test_a_bar_in_a_cell_stays_a_bar() -> None:
    assert table_lines(["room", "a|b"], [["hall|way", "1"]]) == [
        "| room | a\\|b |",
        "| --- | --- |",
        "| hall\\|way | 1 |",
    ]
