"""A Mitsuba 3 BSDF that gives `roughconductor` the height-correlated masking and shadowing of pbrt-v4.

Mitsuba multiplies the two one-sided terms, G = G1(wi) G1(wo); pbrt-v4 uses Smith's height-correlated form
G = 1 / (1 + Lambda(wi) + Lambda(wo)) with G1 = 1 / (1 + Lambda). Their quotient is
1 / (G1(wi) + G1(wo) - G1(wi) G1(wo)), at least 1. Densities of sampling stay as they are.
"""
import drjit as dr
import mitsuba as mi


class HeightCorrelated(mi.BSDF):
    """The nested `roughconductor`, times the quotient of the two forms. Properties: nested, alpha_u, alpha_v, normal_kind."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.inner = props["nested"]
        self.alpha = props["alpha_u"], props["alpha_v"]
        self.kind = getattr(mi.MicrofacetType, {"ggx": "GGX", "beckmann": "Beckmann"}[props["normals"]])
        self.m_components = [self.inner.flags(i) for i in range(self.inner.component_count())]
        self.m_flags = self.inner.flags()

    def quotient(self, wi, wo, active):
        facets = mi.MicrofacetDistribution(self.kind, *self.alpha, True)
        h = dr.normalize(wi + wo)
        a, b = facets.smith_g1(wi, h), facets.smith_g1(wo, h)
        below = a + b - a * b
        return dr.select(active & (below > 0), 1 / below, 1)

    def sample(self, ctx, si, sample1, sample2, active=True):
        s, weight = self.inner.sample(ctx, si, sample1, sample2, active)
        return s, weight * self.quotient(si.wi, s.wo, active)

    def eval(self, ctx, si, wo, active=True):
        return self.inner.eval(ctx, si, wo, active) * self.quotient(si.wi, wo, active)

    def pdf(self, ctx, si, wo, active=True):
        return self.inner.pdf(ctx, si, wo, active)

    def eval_pdf(self, ctx, si, wo, active=True):
        value, pdf = self.inner.eval_pdf(ctx, si, wo, active)
        return value * self.quotient(si.wi, wo, active), pdf

    def traverse(self, callback):
        pass

    def to_string(self):
        return "HeightCorrelated[]"


mi.register_bsdf("heightcorrelated", lambda props: HeightCorrelated(props))
