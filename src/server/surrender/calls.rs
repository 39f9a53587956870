//! The calls of the client that set how light is drawn, and so change nothing here.

/// Calls that set how a picture is drawn, in a way that a scene of isotherm sets itself or that has no counterpart. Scripts make them as a matter of form.
pub(crate) const FORMAL: [&str; 22] = [
    "closeViewer",
    "createBRDF",
    "enableAutoUpdate",
    "enableDoublePrecisionMode",
    "enableFastPSFMode",
    "enableGlobalDynamicShadowMap",
    "enableMultilateralFiltering",
    "enablePreviewMode",
    "enableRaySharing",
    "enableRaytracing",
    "enableRegularPixelSampling",
    "enableSpecularOptimization",
    "getDoublePrecisionMode",
    "setCompressionLevel",
    "setCubeMapSize",
    "setMaxShadowRays",
    "setNbSamplesPerPixel",
    "setObjectElementBRDF",
    "setObjectSamples",
    "setShadowMapSize",
    "setSunPower",
    "updateDisplay",
];

/// Calls that would change the picture if they were followed. The answer to such a call is a warning.
pub(crate) const WITHOUT_EFFECT: [&str; 38] = [
    "attachDynamicTexture",
    "createUserDataTexture",
    "createVideoTexture",
    "enableIrradianceMode",
    "enableLOSmapping",
    "enablePathTracing",
    "enablePhotonAccumulation",
    "enableRegularPSFSampling",
    "enableScanningDeviceMode",
    "enableSkipPixelSampling",
    "enableTimeMapping",
    "generateReplay",
    "loadMotionModel",
    "loadPSFModel",
    "loadProjectionModel",
    "loadSpectrumModel",
    "loadTextureObject",
    "loadTimeSamplingModel",
    "record",
    "setBackground",
    "setCubeMapZNear",
    "setFSAA",
    "setFocus",
    "setIntegrationTime",
    "setMaxSamplesPerPixel",
    "setMaxSecondaryRays",
    "setNearPlane",
    "setObjectDynamicCubeMap",
    "setObjectDynamicShadowMap",
    "setObjectMotion",
    "setPSF",
    "setPSFSigma",
    "setPSFWithTail",
    "setPhotonMapSamplingStep",
    "setSelfVisibilitySamplingStep",
    "setStarThreshold",
    "setSunPowerAtDistance",
    "updateDynamicTexture",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_sorted_and_in_one_list_only() {
        assert!(FORMAL.is_sorted() && WITHOUT_EFFECT.is_sorted());
        assert!(FORMAL.iter().all(|name| !WITHOUT_EFFECT.contains(name)));
    }
}
