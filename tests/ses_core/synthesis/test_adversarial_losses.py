import torch

from ses_core.synthesis.adversarial_losses import discriminator_loss, generator_loss


def test_losses_are_those_of_equation_1() -> None:
    real_logits = torch.tensor([[0.3], [-1.2]])
    fake_logits = torch.tensor([[2.0], [0.7]])
    real, fake = torch.sigmoid(real_logits), torch.sigmoid(fake_logits)
    value = real.log().mean() + (1.0 - fake).log().mean()
    assert torch.allclose(discriminator_loss(real_logits, fake_logits), -value)
    saturating = (1.0 - fake).log().mean()
    assert torch.allclose(generator_loss(fake_logits, loss="saturating"), saturating)
    assert torch.allclose(generator_loss(fake_logits, loss="non-saturating"), -fake.log().mean())
