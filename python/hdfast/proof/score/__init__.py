"""Scores of answers against labels, with intervals and pass marks."""

from hdfast.proof.score.answer import Answer, read_answer
from hdfast.proof.score.card import ScoreCard, score
from hdfast.proof.score.judge import Case
from hdfast.proof.score.value import Score

__all__ = ["Answer", "Case", "Score", "ScoreCard", "read_answer", "score"]
