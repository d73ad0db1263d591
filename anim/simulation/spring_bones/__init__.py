"""Spring bones: secondary motion of joint chains, after VRMC_springBone and as damped oscillators."""
