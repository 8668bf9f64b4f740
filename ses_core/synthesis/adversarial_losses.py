"""The two sides of the paper's equation 1, of logits: the sigmoid is in the loss."""

from torch import Tensor
from torch.nn import functional


def discriminator_loss(real: Tensor, fake: Tensor) -> Tensor:
    """Equation 1 for D, negated, of the logits (B, 1) of real and generated environments."""
    return functional.softplus(-real).mean() + functional.softplus(fake).mean()


def generator_loss(fake: Tensor, *, loss: str) -> Tensor:
    """Equation 1's log(1 - D(G(z))) of the logits (B, 1), or the non-saturating -log D(G(z)).

    The first pulls least where D is sure, which is where G has most to learn.
    """
    if loss == "saturating":
        return -functional.softplus(fake).mean()
    return functional.softplus(-fake).mean()
