import {
  pathsV1JobsIdLabelsGetParametersQueryFormatValues,
  pathsV1JobsIdMeshGetParametersQueryFormatValues,
  pathsV1JobsIdReportGetParametersQueryFormatValues,
  pathsV1JobsIdRidgesGetParametersQueryFormatValues,
} from './schema.js';

/** The formats in which each part of a result is handed out. */
export const meshFormats = pathsV1JobsIdMeshGetParametersQueryFormatValues;
export const labelFormats = pathsV1JobsIdLabelsGetParametersQueryFormatValues;
export const ridgeFormats = pathsV1JobsIdRidgesGetParametersQueryFormatValues;
export const reportFormats = pathsV1JobsIdReportGetParametersQueryFormatValues;
