export function repositoryUrl(remote: string): string | undefined;
export function setRepository(on: boolean): void;
