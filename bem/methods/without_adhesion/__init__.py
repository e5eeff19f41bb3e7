"""Contact without adhesion, by Hertz and Ting in one unknown."""
